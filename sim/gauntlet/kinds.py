"""The kinds of faults, one line each: name, what happens, and who draws its steps."""

from __future__ import annotations

from sim.gauntlet import hostile, joints, power, readings
from sim.gauntlet.fault import TUBES, FaultKind, once
from telemetry.messages import BASE, ENCODER

LOST_DATABASE = 48.0  # s until the tubes have been asked for what the database no longer has

KINDS: tuple[FaultKind, ...] = (
    FaultKind("node-cut", "a node loses its power", power.power_cut(TUBES)),
    FaultKind("encoder-cut", "the encoder loses its power, its clock runs on", power.power_cut([ENCODER])),
    FaultKind("encoder-from-zero", "the encoder starts again and counts its time from zero", power.encoder_from_zero),
    FaultKind("ground-cut", "the ground station loses its power", power.power_cut([BASE])),
    FaultKind("ground-off-across-stop", "the ground station is off during a stop", power.ground_off_across_stop),
    FaultKind("all-cut", "everything loses its power at once", power.cut_all),
    FaultKind("cut-while-saving", "the power goes in the middle of a write", power.cut_while_saving),
    FaultKind("cut-again-and-again", "the power of a process comes and goes", power.cut_again_and_again),
    FaultKind("frozen", "a process stands still for up to 30 s", power.frozen),
    FaultKind("slow", "what a process sends comes up to 1.5 s late", joints.slow),
    FaultKind("node-memory-lost", "a node loses its saved state", power.power_cut(TUBES, power.delete("slot-*"))),
    FaultKind("old-receipts", "a node loses its saved state, old frames come", hostile.memory_lost_with_old_receipts),
    FaultKind("node-memory-rots", "every slot of a node is damaged", power.power_cut(TUBES, power.damage("slot-*"))),
    FaultKind("bytes-rot", "single bytes of all that a node keeps change", power.power_cut(TUBES, power.rot)),
    FaultKind("boots-damaged", "a node's count of starts is damaged", power.power_cut(TUBES, power.damage("boots"))),
    FaultKind(
        "encoder-boots-lost", "the encoder's count of starts is lost", power.power_cut([ENCODER], power.delete("boots"))
    ),
    FaultKind(
        "surveys-lost", "a node's log of receipted surveys is lost", power.power_cut(TUBES, power.delete("surveys"))
    ),
    FaultKind("node-disk-refuses", "a node's disk is full or read-only for a while", power.refused_disk(*TUBES)),
    FaultKind("ground-disk-refuses", "the database's disk is full or read-only for a while", power.refused_disk(BASE)),
    FaultKind("folders-swapped", "two tubes have each other's saved state", power.swap_folders),
    FaultKind("same-number", "a tube's place is taken by one with its neighbour's number", power.same_number),
    FaultKind(
        "database-deleted",
        "the database is deleted",
        power.power_cut([BASE], power.delete("ground.sqlite*")),
        LOST_DATABASE,
    ),
    FaultKind(
        "database-old",
        "the database is restored from a backup",
        power.power_cut([BASE], power.restore_backup),
        LOST_DATABASE,
    ),
    FaultKind("clock-jumps", "the clock of a process jumps ahead by up to 20 s", joints.clock_jumps),
    FaultKind("clock-drifts", "the clock of a process runs up to 0.1 % fast or slow", joints.clock_drifts),
    FaultKind("loss", "30 % of the frames are lost", joints.frames(loss=0.3)),
    FaultKind("bursts", "20 frames in a row are lost, now and then", joints.frames(burst=0.02)),
    FaultKind("duplicates", "half of the frames come twice", joints.frames(duplicate=0.5)),
    FaultKind("reordering", "frames overtake each other by up to 0.3 s", joints.frames(reordering=0.3)),
    FaultKind("corruption", "a fifth of the frames are damaged", joints.frames(corrupt=0.2)),
    FaultKind("asymmetric", "one port is hardly heard, the other well", joints.asymmetric),
    FaultKind("joint-severed", "nothing passes the top joint", joints.severed(both_ways=True)),
    FaultKind("joint-deaf", "nothing passes the top joint downward", joints.severed(both_ways=False)),
    FaultKind("gyro-stuck", "a gyroscope repeats itself", readings.sensor(readings.gyro_stuck)),
    FaultKind("gyro-saturated", "a gyroscope is at its range", readings.sensor(readings.gyro_saturated)),
    FaultKind(
        "gyro-saturated-below", "a gyroscope is at its other range", readings.sensor(readings.gyro_saturated_below)
    ),
    FaultKind("gyro-step", "the bias of a gyroscope is 3 deg/s another", readings.sensor(readings.gyro_step)),
    FaultKind("gyro-scale", "a gyroscope shows a tenth too much", readings.sensor(readings.gyro_scale)),
    FaultKind("force-stuck", "an accelerometer repeats itself", readings.sensor(readings.force_stuck)),
    FaultKind("force-saturated", "an accelerometer is at its range", readings.sensor(readings.force_saturated)),
    FaultKind("not-finite", "a sensor gives readings that are no numbers", readings.sensor(readings.not_finite)),
    FaultKind("encoder-dead", "the encoder counts no more for a while", readings.encoder_dead),
    # alone: a tube that starts afresh after the slip has no other yaw to compare with
    FaultKind("encoder-slips", "the encoder loses its grip once", readings.encoder_slips, alone=True),
    FaultKind("depth-lost", "no depth is measured", readings.depth_lost),
    FaultKind("depth-jumps-up", "the depth is 1.5 m too small", readings.depth_off(-1.5)),
    FaultKind("depth-jumps-down", "the depth is 0.8 m too large", readings.depth_off(0.8)),
    FaultKind("depth-backwards", "the depth runs backwards by 0.6 m/s", readings.depth_backwards),
    FaultKind("depth-ahead", "a depth comes from the future", once(readings.depth_ahead)),
    FaultKind("garbage", "random bytes come at every port and key", once(hostile.garbage)),
    FaultKind("forged-neighbour", "a forged hello and forged receipts come", once(hostile.forged_frames)),
    FaultKind("wild-numbers", "well-formed messages with extreme numbers come", once(hostile.wild_numbers)),
    FaultKind("replay", "recorded frames come again", once(hostile.replay)),
    FaultKind("splice", "payloads of recorded frames come in other frames", once(hostile.splice)),
    FaultKind("second-ground", "a second base station speaks to the encoder", hostile.second_ground),
)
KIND_OF = {kind.name: kind for kind in KINDS}
