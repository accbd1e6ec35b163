"""The parts of the crew's screen as text: functions of what is known and of the time, 80 columns in all."""

from __future__ import annotations

import math
from typing import Any

from rich.text import Text

from borechain.crew.picture import GRAVE, SERIOUS, Picture

View = dict[str, Any]
WIDTH = 80
PLAN_WIDTH, PLAN_HEIGHT = 23, 11
STRIP_WIDTH, STRING_WIDTH = 26, 29
STYLES = {
    "on_target": "bold black on green",
    "watch": "bold black on yellow",
    "steer": "bold white on dark_orange3",
    "out": "bold white on red",
    "dont_know": "bold white on magenta",
}
LEVEL_STYLES = {GRAVE: "bold red", SERIOUS: "yellow"}
QUIET, OLD = "bright_black", "reverse bright_black"


def header_panel(picture: Picture, now: float) -> Text:
    """One line: which hole, how fresh, how deep, what stands."""
    status, verdict = picture.status, picture.verdict(now)
    live = f"live {picture.age(now):.1f}s" if picture.is_live(now) else "NOT LIVE"
    bit, target = status.get("bit_md_m"), verdict.get("target_m")
    depth = f"MD {'-' if bit is None else f'{bit:.1f}'}/{'-' if target is None else f'{target:.1f}'} m"
    health, tubes = status.get("health", "-"), status.get("tubes", 0)
    line = f"HOLE {picture.rig} * {live}  {depth}  tubes {tubes}  health {health}  alarms {len(picture.alarms)}"
    return fit_line(line, "bold" if picture.is_live(now) else OLD)


def verdict_panel(picture: Picture, now: float) -> Text:
    """Three lines: the word and the numbers, what to do, why."""
    found = picture.verdict(now)
    style = STYLES[found["verdict"]]
    reasons = [why for why in found["why"] if not found["line"].endswith(why)]
    lines = [short_line(found["line"]), found["todo"], "; ".join(reasons)]
    if found["verdict"] == "dont_know" and found["by_surveys"] != "dont_know":
        lines[1] = f"the surveys alone said {found['by_surveys'].replace('_', ' ')}; do not count on it"
    return Text("\n").join(fit_line(f" {line}", style) for line in lines)


def short_line(line: str) -> str:
    """The verdict's line; where it is too long without its deadline, which is in the line below it."""
    return line if len(line) < WIDTH else line.partition("; act ")[0]


def plan_panel(picture: Picture) -> Text:
    """Seen from above: tolerance ring at the target, way of the hole, where it ends."""
    column = picture.answers.get("column")
    grid = [[" "] * PLAN_WIDTH for _ in range(PLAN_HEIGHT)]
    middle_x, middle_y = PLAN_WIDTH // 2, PLAN_HEIGHT // 2
    if column is None:
        return Text("plan: nothing surveyed".ljust(PLAN_WIDTH), QUIET)
    end = column["projection"]
    limit = end["limit_cm"] if end is not None else column["worst"]["limit_cm"]
    marks = [(row["north_cm"], row["east_cm"], "o") for row in column["stations"]]
    marks += [(marks[-1][0], marks[-1][1], "@")] if marks else []
    marks += [(end["north_cm"], end["east_cm"], "x")] if end is not None else []
    reach = max([limit, *(math.hypot(n, e) for n, e, _ in marks)], default=1.0) or 1.0
    scale = (middle_y - 0.5) / reach

    def put(north: float, east: float, mark: str) -> None:
        x, y = middle_x + round(2.0 * east * scale), middle_y - round(north * scale)
        if 0 <= x < PLAN_WIDTH and 0 <= y < PLAN_HEIGHT:
            grid[y][x] = mark

    for k in range(72):
        angle = math.tau * k / 72
        put(limit * math.cos(angle), limit * math.sin(angle), ".")
    put(0.0, 0.0, "+")
    for north, east, mark in marks:
        put(north, east, mark)
    grid[0][middle_x] = "N"
    return Text("\n".join("".join(row) for row in grid))


def strip_panel(picture: Picture) -> Text:
    """Deviation over depth against the tolerance, the newest depths; marks at 50 and 80 percent."""
    column = picture.answers.get("column")
    rows = [] if column is None else column["stations"][1:][-(PLAN_HEIGHT - 2) :]
    lines = [Text("  MD m  of the tolerance".ljust(STRIP_WIDTH), "bold")]
    lines += [strip_row(row) for row in rows]
    if column is not None and column["projection"] is not None:
        lines.append(ending_row(column["projection"], column["ahead"]))
    return Text("\n").join(lines)


def strip_row(row: View) -> Text:
    """One depth of the strip."""
    used, cells = row["used_percent"], 12
    bar = ["=" if cells * used / 100.0 > k else " " for k in range(cells)]
    for level in (0.5, 0.8):
        if bar[int(level * cells)] == " ":
            bar[int(level * cells)] = ":"
    style = "bold red" if used >= 100.0 else "yellow" if used >= 80.0 else ""
    return Text(f"{row['md_m']:6.1f} |{''.join(bar)}|{used:4.0f}%".ljust(STRIP_WIDTH), style)


def ending_row(row: View, ahead: View) -> Text:
    """Where it ends: the interval of 95 % as a bar, the place expected in it, and the chance of ending within."""
    cells, limit = 12, row["limit_cm"]
    low, at, high = (
        cells * (row["deviation_cm"] + side * ahead["half_width_cm"]) / limit if limit > 0.0 else math.inf
        for side in (-1.0, 0.0, 1.0)
    )
    bar = ["-" if low < k + 1 and high > k else " " for k in range(cells)]
    if at < cells:
        bar[int(at)] = "x"
    beyond = ">" if high > cells else "|"
    within = ahead["within_percent"]
    style = "bold red" if within < 50.0 else "yellow" if within < 95.0 else ""
    return Text(f" ends |{''.join(bar)}{beyond}P{within:3.0f}%".ljust(STRIP_WIDTH), style)


def string_panel(picture: Picture) -> Text:
    """A row a tube from the top down, grey where nothing is wrong; of a long string the tubes that are not well.

    Below it the joints with the neighbours, where the hole is a column of a wall.
    """
    below = wall_lines(picture)
    room = PLAN_HEIGHT - 1 - len(below)
    lines = [Text("tube yaw deg sigma age mode", "bold")]
    nodes = picture.nodes
    if len(nodes) > room:
        wrong = [node for node in nodes if node.get("stale") or node.get("flags")]
        nodes = [*wrong, *(node for node in nodes if node not in wrong)][:room]
        lines[0] = Text(f"tube yaw deg sigma age ({len(picture.nodes)})", "bold")
    return Text("\n").join([*lines, *(tube_row(node) for node in nodes), *below])


def wall_lines(picture: Picture) -> list[Text]:
    """The joints with the neighbours, the worst first, two at most; none where there is no wall."""
    found = picture.answers.get("wall", {}).get("wall")
    if found is None:
        return []
    if found["problem"] is not None:
        return [Text(f"wall: {found['problem']}"[:STRING_WIDTH], "yellow")]
    joints = sorted(found["joints"], key=lambda joint: -(joint["probability_where_surveyed"] or 0.0))[:2]
    return [joint_row(joint, found) for joint in joints]


def joint_row(joint: View, found: View) -> Text:
    """One joint: how thick, and how probably too thin where it is surveyed."""
    chance, thickness = joint["probability_where_surveyed"], joint["thickness_m"]
    if chance is None or thickness is None:
        return Text(f"{joint['joint']} not surveyed yet"[:STRING_WIDTH], QUIET)
    style = "bold red" if thickness < found["required_thickness_m"] else ""
    style = style or ("yellow" if chance > found["allowed_probability"] else QUIET)
    return Text(f"{joint['joint']} {100.0 * thickness:.0f} cm P(thin) {chance:.1g}"[:STRING_WIDTH], style)


def tube_row(node: View) -> Text:
    """One tube."""
    age = "  -" if node.get("age_s") is None else f"{min(node['age_s'], 999.0):3.0f}"
    style = "bold red" if node.get("stale") else "yellow" if node.get("flags") else QUIET
    if "yaw_deg" not in node:
        return Text(f"{node['tube']:3d}      -     - {age} no state", style)
    mode = "silent" if node.get("stale") else node["mode"][:8]
    return Text(f"{node['tube']:3d} {node['yaw_deg']:6.1f} {node['sigma_yaw_deg']:5.2f} {age} {mode}", style)


def alarms_panel(picture: Picture, chosen: int, rows: int) -> Text:
    """Open alarms, the worst first; the chosen one is marked."""
    found = picture.alarms
    load = picture.answers.get("alarms", {})
    note = f"  FLOOD, {load['left_out']} more" if load.get("flood") else ""
    lines = [Text(f"ALARMS {len(found)} open{note}".ljust(WIDTH), "bold")]
    chosen = min(chosen, len(found) - 1)  # those below may have gone since it was chosen
    first = max(0, chosen - rows + 2)
    for place, alarm in list(enumerate(found))[first : first + rows - 1]:
        lines.append(alarm_row(alarm, is_chosen=place == chosen))
    if not found:
        lines.append(Text("none", QUIET))
    return Text("\n").join(lines)


def alarm_row(alarm: View, *, is_chosen: bool) -> Text:
    """One alarm: number, state, what, where, direction, detail."""
    subject = "" if alarm["subject"] == "column" else f" {alarm['subject']}"
    where = "" if alarm["md_m"] is None else f" {alarm['md_m']:.1f} m"
    way = "" if alarm["wind"] is None else f" {alarm['azimuth_deg']:g} deg {alarm['wind']}"
    threshold = f" over {alarm['threshold']}" if alarm["threshold"] else ""
    state = f"ack {alarm['acknowledged_by']}" if alarm["state"] == "acknowledged" else alarm["state"]
    line = f"{'>' if is_chosen else ' '}{alarm['number']:3d} {state} {alarm['code']}{subject}{where}{way}"
    style = LEVEL_STYLES.get(alarm["level"], "") if alarm["state"] in ("raised", "latched") else QUIET
    return fit_line(f"{line}: {alarm['detail']}{threshold}", style)


def actions_panel(picture: Picture, rows: int) -> Text:
    """What was ordered here and what became of it, else the newest orders of anybody."""
    lines = [Text("ACTIONS", "bold")]
    course = picture.done[-(rows - 1) :] or [order_line(order) for order in picture.orders[-(rows - 1) :]]
    return Text("\n").join([*lines, *(fit_line(line, "") for line in course)])


def order_line(order: View) -> str:
    """One order of anybody."""
    whom = "" if order["tube"] is None else f" tube {order['tube']}"
    action = f" {order['action']}" if order["action"] else ""
    detail = f": {order['detail']}" if order["detail"] else ""
    return f"{order['by']}: {order['command']}{action}{whom} {order['state']}{detail}"


def fit_line(line: str, style: str) -> Text:
    """A line of exactly the width of the screen; what does not fit is cut with a mark."""
    shown = line if len(line) <= WIDTH else f"{line[: WIDTH - 1]}~"
    return Text(shown.ljust(WIDTH), style)
