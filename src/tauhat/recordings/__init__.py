"""Recordings: maps, readers, writers, model-free checks and signal processing."""

from tauhat.recordings.checks import check_limits, check_log
from tauhat.recordings.choice import choose_cutoff, choose_processing
from tauhat.recordings.findings import Finding, worst
from tauhat.recordings.log import Log
from tauhat.recordings.log_source import LogSource
from tauhat.recordings.logmap import Coupling, LogMap, RowWindow, SignalMap, TimeMap, parse_rows
from tauhat.recordings.mapfile import find_map, load_map, parse_map
from tauhat.recordings.periods import PeriodAverage, average_periods
from tauhat.recordings.processing import Processing
from tauhat.recordings.reading import read_chunks, read_log, read_recording
from tauhat.recordings.recognising import map_skeleton
from tauhat.recordings.recording import Recording, Source
from tauhat.recordings.writing import write_columns, write_recording

__all__ = [
    "Coupling",
    "Finding",
    "Log",
    "LogMap",
    "LogSource",
    "PeriodAverage",
    "Processing",
    "Recording",
    "RowWindow",
    "SignalMap",
    "Source",
    "TimeMap",
    "average_periods",
    "check_limits",
    "check_log",
    "choose_cutoff",
    "choose_processing",
    "find_map",
    "load_map",
    "map_skeleton",
    "parse_map",
    "parse_rows",
    "read_chunks",
    "read_log",
    "read_recording",
    "worst",
    "write_columns",
    "write_recording",
]
