"""Reading XML that nobody vouches for: no document types, no entities, bounded depth and size."""

from __future__ import annotations

from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from tauhat.errors import RobotError
from tauhat.robots.source import DescriptionSource

_DEEPEST = 100  # levels of nesting; real URDFs stay under 10
_MOST_ELEMENTS = 500_000
_ENCODING_OF_TEXT = "utf-8"


class _GuardedBuilder:
    """Builds the element tree and refuses what a robot description never needs."""

    def __init__(self, where: str) -> None:
        self._where = where
        self._builder = TreeBuilder()
        self._depth = 0
        self._elements = 0

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self._depth += 1
        self._elements += 1
        if self._depth > _DEEPEST:
            raise RobotError("absurdly deep XML", where=self._where, expected=f"at most {_DEEPEST} levels")
        if self._elements > _MOST_ELEMENTS:
            raise RobotError("absurdly many XML elements", where=self._where, expected=f"at most {_MOST_ELEMENTS}")
        if tag.startswith("xacro:"):
            remedy = "run `xacro FILE > robot.urdf` first"
            raise RobotError("this is a xacro file, not a URDF", where=self._where, got=f"<{tag}>", remedy=remedy)
        self._builder.start(tag, attributes)

    def end(self, tag: str) -> None:
        self._depth -= 1
        self._builder.end(tag)

    def document_type(self, name: str, *_: object) -> None:
        remedy = "delete the <!DOCTYPE ...> with its entities"
        raise RobotError("document types and entities are refused", where=self._where, got=name, remedy=remedy)

    def close(self) -> Element:
        return self._builder.close()


def parse_untrusted_xml(source: DescriptionSource) -> Element:
    """Return the root element of an XML document.

    Raises
    ------
    RobotError
        not XML, cut off, with a document type, a xacro file, nested too deep, or too large.
    """
    builder = _GuardedBuilder(source.where)
    parser = expat.ParserCreate(_ENCODING_OF_TEXT if source.where == "text" else None)
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.StartDoctypeDeclHandler = builder.document_type
    try:
        parser.Parse(source.content, True)
    except expat.ExpatError as error:
        remedy = "is it cut off, or not a URDF at all?"
        raise RobotError("not well-formed XML", where=source.where, got=error, remedy=remedy) from error
    except (LookupError, ValueError) as error:
        raise RobotError("XML in an encoding that is not supported", where=source.where, got=error) from error
    return builder.close()
