"""A certificate that ends within a month is an alarm by name, until it is made anew."""

from __future__ import annotations

import datetime
from pathlib import Path

from sealed_string import NOW, make_folder

from borechain.pki.rig_keys import renew_certificate
from groundstation.service.alarms.certificate_watch import LOOK_EVERY, CertificateWatch
from groundstation.service.alarms.rig_alarms import RigAlarms

DAY = datetime.timedelta(days=1)


def subjects(alarms: RigAlarms) -> list[str]:
    return sorted(alarm.subject for alarm in alarms)


def test_each_end_is_told_once_and_cleared_by_what_is_made_anew(tmp_path: Path) -> None:
    folder, alarms, date = make_folder(tmp_path / "stick", 1), RigAlarms(), NOW
    watch, now = CertificateWatch(folder, alarms, lambda: date), 1000.0

    def look(after: float) -> list[str]:
        nonlocal now
        now += after
        watch.look(now)
        return subjects(alarms)

    assert look(0.0) == []
    date = NOW + 160 * DAY
    assert look(LOOK_EVERY / 2.0) == []  # it looks now and then
    assert look(LOOK_EVERY) == ["driller", "operator"]
    renew_certificate(folder, "driller", date)
    assert look(LOOK_EVERY + 1.0) == ["operator"]
    for _ in range(5):
        look(LOOK_EVERY + 1.0)
    (alarm,) = alarms
    assert alarm.count == 1
    assert "ends in 23 days" in alarm.detail
    date = NOW + 200 * DAY
    look(LOOK_EVERY + 1.0)
    assert "has ended" in alarm.detail
    date = NOW + 720 * DAY
    assert look(LOOK_EVERY + 1.0) == ["base", "depth", "driller", "encoder", "medium", "operator", "router"]
    date = NOW - 10 * DAY  # a clock that was put back: all begin in its future
    look(LOOK_EVERY + 1.0)
    assert {"ca", "tube-1"} <= set(subjects(alarms))
    assert all("expected a clock that is set" in alarm.detail for alarm in alarms)


def test_without_keys_there_is_nothing_to_look_at() -> None:
    alarms = RigAlarms()
    CertificateWatch(None, alarms).look(0.0)
    assert subjects(alarms) == []
