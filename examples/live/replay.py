"""Send a log to `tauhat serve` as if the robot ran now, and print what touches it.

    tauhat serve estimate.json --rate 250                          # in one terminal; prints its addresses
    python examples/live/replay.py ws://127.0.0.1:8765/ log.csv    # in another

The log's rate must be the server's. What its columns mean says the map beside it, `log.map.toml`, or `--map`.
The address may be that of any channel: `ws://host:port/`, `udp://host:port` or `unix:path`. A program that reads a
robot does the same with `sender.send(t, q, tau)` for every sample and `sender.answers()` for what has come back.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

from tauhat.errors import TauhatError
from tauhat.live import Sender, read_token
from tauhat.recordings import read_recording


def main() -> None:
    """Replay the log that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("address")
    parser.add_argument("log", type=Path)
    parser.add_argument(
        "--speed", type=float, default=1.0, help="times as fast as recorded; inf for as fast as it goes"
    )
    parser.add_argument("--map", type=Path, help="what the log's columns mean; else log.map.toml beside it")
    parser.add_argument("--token-file", type=Path)
    options = parser.parse_args()
    token = None if options.token_file is None else read_token(options.token_file)
    log, answered, largest = read_recording(options.log, map=options.map), 0, 0.0
    with Sender(options.address, token=token) as sender:
        for answer in sender.replay(log, speed=options.speed):
            answered += 1
            largest = max(largest, math.hypot(*answer["wrench"][:3]))
            if "event" in answer:
                print(f"{answer['t']:8.3f} s  contact {answer['event']:5}  {answer['link'] or ''}")
        for notice in sender.notices:
            print(notice)
    print(f"{answered} of {log.n_t} samples answered, largest force {largest:.1f} N")


if __name__ == "__main__":
    try:
        main()
    except TauhatError as error:
        sys.exit(f"error: {error}")
    except KeyboardInterrupt:
        sys.exit(130)
