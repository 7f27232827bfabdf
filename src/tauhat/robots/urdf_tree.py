"""Whether the joints of a URDF hang its links into one tree."""

from __future__ import annotations

from tauhat.errors import RobotError
from tauhat.robots.naming import advice_on_name
from tauhat.robots.urdf_description import UrdfDescription


def check_tree(description: UrdfDescription) -> None:
    """Check that every joint joins known links and that all links form one tree.

    Raises
    ------
    RobotError
        no links, a missing link, a link with two parents, a loop, several roots.
    """
    where, links = description.name, description.links
    if not links:
        raise RobotError("no links", where=where, remedy="is this a URDF?")
    parents = _parents(description)
    roots = [link for link in links if link not in parents]
    if not roots:
        raise RobotError("the links form a loop: no link is the root", where=where, remedy="cut the loop at one joint")
    if len(roots) > 1:
        got = f"{len(roots)}: {', '.join(roots[:4])}"
        remedy = "connect them by joints, or delete the loose links"
        raise RobotError("several root links", where=where, expected=1, got=got, remedy=remedy)
    _refuse_loop(description, roots[0])


def _parents(description: UrdfDescription) -> dict[str, str]:
    parents: dict[str, str] = {}
    for joint in description.joints:
        where = f"joint {joint.name}"
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in description.links:
                remedy = advice_on_name(link, description.links)
                raise RobotError(f"{role} link is missing", where=where, got=repr(link[:60]), remedy=remedy)
        if joint.child in parents:
            got = f"{parents[joint.child]} and {joint.parent}"
            raise RobotError("a link has two parents", where=f"link {joint.child}", got=got, remedy="cut the loop")
        parents[joint.child] = joint.parent
    return parents


def _refuse_loop(description: UrdfDescription, root: str) -> None:
    children: dict[str, list[str]] = {}
    for joint in description.joints:
        children.setdefault(joint.parent, []).append(joint.child)
    reached, waiting = {root}, [root]
    while waiting:
        below = children.get(waiting.pop(), [])
        reached.update(below)
        waiting.extend(below)
    unreached = [link for link in description.links if link not in reached]
    if unreached:
        got = ", ".join(unreached[:4])
        raise RobotError("links form a loop", where=description.name, got=got, remedy="cut the loop at one joint")
