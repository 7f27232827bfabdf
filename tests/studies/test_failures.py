"""Long studies keep what is done: failures stand where they were, and are heard at once."""

from __future__ import annotations

import pytest

from tauhat.errors import ModelError, SimulationError
from tauhat.studies.failures import Failures
from tauhat.studies.study import Chapter
from tauhat.workers import LocalWorkers

ALONE = LocalWorkers(count=1)
GOOD = Chapter(title="good", text=("so",))


def inverse(item: int) -> float:
    if item < 0:
        raise SimulationError("too low", where="item", got=item)
    return 1.0 / item


def refused() -> Chapter:
    raise ModelError("nothing to tell of")


def broken() -> Chapter:
    return GOOD.charts[3]


def test_items_that_are_refused_are_named_and_the_others_stay():
    heard: list[str] = []
    failures = Failures(heard.append)
    assert list(failures.results(ALONE, inverse, [1, -1, 2], what="items")) == [1.0, 0.5]
    (line,) = failures.lines
    assert line == "2 of 3 items failed: item: too low; got -1"
    assert heard == ["1 of 3 items", "2 of 3 items", line, "3 of 3 items"]


def test_a_defect_in_an_item_is_no_refusal():
    with pytest.raises(ZeroDivisionError):
        list(Failures(str).results(ALONE, inverse, [1, 0], what="items"))


def test_a_chapter_that_fails_leaves_its_line_in_its_place():
    heard: list[str] = []
    failures = Failures(heard.append)
    told = [failures.chapter(str(k), write) for k, write in enumerate((lambda: GOOD, refused, broken, lambda: GOOD))]
    assert told[0] is told[3] is GOOD
    assert [chapter.title for chapter in told] == ["good", "1", "2", "good"]
    assert told[1].text == ('the chapter "1" failed: nothing to tell of',)
    assert "IndexError: tuple index out of range (test_failures.py, line " in told[2].text[0]
    assert tuple(heard) == failures.lines == (*told[1].text, *told[2].text)
    assert failures.summary("Good.") == f"Good. Missing: {told[1].text[0]}; {told[2].text[0]}."
    assert Failures(str).summary("Good.") == "Good."


def test_whoever_interrupts_a_chapter_ends_the_study():
    def interrupted() -> Chapter:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Failures(str).chapter("x", interrupted)
