"""The kinds of faults, one line each: name, what happens, who draws its steps; and what the system does about it."""

from __future__ import annotations

from sim.gauntlet import deceptions, hostile, joint_faults, power, readings
from sim.gauntlet.expected_doubts import EXPECTED
from sim.gauntlet.fault import TUBES, FaultKind, momentary_fault
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
    FaultKind("frozen", "a process stands still for up to 30 s", power.freeze_process),
    FaultKind("slow", "what a process sends comes up to 1.5 s late", joint_faults.slow_process),
    FaultKind("node-memory-lost", "a node loses its saved state", power.power_cut(TUBES, power.delete_files("slot-*"))),
    FaultKind("old-receipts", "a node loses its saved state, old frames come", hostile.memory_lost_with_old_receipts),
    FaultKind(
        "node-memory-rots", "every slot of a node is damaged", power.power_cut(TUBES, power.damage_files("slot-*"))
    ),
    FaultKind("bytes-rot", "single bytes of all that a node keeps change", power.power_cut(TUBES, power.rot_bytes)),
    FaultKind(
        "boots-damaged", "a node's count of starts is damaged", power.power_cut(TUBES, power.damage_files("boots"))
    ),
    FaultKind(
        "encoder-boots-lost",
        "the encoder's count of starts is lost",
        power.power_cut([ENCODER], power.delete_files("boots")),
    ),
    FaultKind(
        "surveys-lost",
        "a node's log of receipted surveys is lost",
        power.power_cut(TUBES, power.delete_files("surveys")),
    ),
    FaultKind("node-disk-refuses", "a node's disk is full or read-only for a while", power.refused_disk(*TUBES)),
    FaultKind("ground-disk-refuses", "the database's disk is full or read-only for a while", power.refused_disk(BASE)),
    FaultKind("folders-swapped", "two tubes have each other's saved state", power.swap_folders),
    FaultKind("same-number", "a tube's place is taken by one with its neighbour's number", power.same_number),
    FaultKind(
        "database-deleted",
        "the database is deleted",
        power.power_cut([BASE], power.delete_files("ground.sqlite*")),
        LOST_DATABASE,
    ),
    FaultKind(
        "database-old",
        "the database is restored from a backup",
        power.power_cut([BASE], power.restore_backup),
        LOST_DATABASE,
    ),
    FaultKind("clock-jumps", "the clock of a process jumps ahead by up to 20 s", joint_faults.clock_jumps),
    FaultKind("clock-drifts", "the clock of a process runs up to 0.1 % fast or slow", joint_faults.clock_drifts),
    FaultKind("loss", "30 % of the frames are lost", joint_faults.disturb_frames(loss=0.3)),
    FaultKind("bursts", "20 frames in a row are lost, now and then", joint_faults.disturb_frames(burst=0.02)),
    FaultKind("duplicates", "half of the frames come twice", joint_faults.disturb_frames(duplicate=0.5)),
    FaultKind("reordering", "frames overtake each other by up to 0.3 s", joint_faults.disturb_frames(reordering=0.3)),
    FaultKind("corruption", "a fifth of the frames are damaged", joint_faults.disturb_frames(corrupt=0.2)),
    FaultKind("asymmetric", "one port is hardly heard, the other well", joint_faults.asymmetric_loss),
    FaultKind("joint-severed", "nothing passes the top joint", joint_faults.sever_joint(both_ways=True)),
    FaultKind("joint-deaf", "nothing passes the top joint downward", joint_faults.sever_joint(both_ways=False)),
    FaultKind("gyro-stuck", "a gyroscope repeats itself", readings.spoil_sensor(readings.gyro_stuck)),
    FaultKind("gyro-saturated", "a gyroscope is at its range", readings.spoil_sensor(readings.gyro_saturated)),
    FaultKind(
        "gyro-saturated-below",
        "a gyroscope is at its other range",
        readings.spoil_sensor(readings.gyro_saturated_below),
    ),
    FaultKind("gyro-step", "the bias of a gyroscope changes by 3 deg/s", readings.spoil_sensor(readings.gyro_step)),
    FaultKind("gyro-scale", "a gyroscope reads 10 % too high", readings.spoil_sensor(readings.gyro_scale)),
    FaultKind("force-stuck", "an accelerometer repeats itself", readings.spoil_sensor(readings.force_stuck)),
    FaultKind("force-saturated", "an accelerometer is at its range", readings.spoil_sensor(readings.force_saturated)),
    FaultKind("not-finite", "a sensor gives NaN or infinite readings", readings.spoil_sensor(readings.not_finite)),
    FaultKind("encoder-dead", "the encoder stops counting for a while", readings.encoder_dead),
    FaultKind("encoder-slips", "the encoder slips once", readings.encoder_slips),
    FaultKind("depth-lost", "no depth is measured", readings.depth_lost),
    FaultKind("depth-jumps-up", "the depth is 1.5 m too small", readings.depth_off(-1.5)),
    FaultKind("depth-jumps-down", "the depth is 0.8 m too large", readings.depth_off(0.8)),
    FaultKind("depth-backwards", "the depth runs backwards by 0.6 m/s", readings.depth_backwards),
    FaultKind("depth-ahead", "a depth comes from the future", momentary_fault(readings.depth_ahead)),
    FaultKind("garbage", "random bytes come at every port and key", momentary_fault(hostile.inject_garbage)),
    FaultKind("forged-neighbour", "a forged hello and forged receipts come", momentary_fault(hostile.forged_frames)),
    FaultKind("wild-numbers", "well-formed messages with extreme numbers come", momentary_fault(hostile.wild_numbers)),
    FaultKind("replay", "recorded frames come again", momentary_fault(hostile.replay_frames)),
    FaultKind("splice", "payloads of recorded frames come in other frames", momentary_fault(hostile.splice_frames)),
    FaultKind("second-ground", "a second base station speaks to the encoder", hostile.second_ground),
    *(
        FaultKind(name, meaning, deceptions.deceive_from(name, act))
        for name, meaning, act in (
            ("force-step", "an accelerometer steps by 5 to 50 mg", deceptions.force_step),
            ("force-creep", "an accelerometer creeps by 0.1 to 0.5 mg/s", deceptions.force_creep),
            ("mount-slips", "the mount of a tube leans over by up to 3 deg and turns", deceptions.mount_slips),
            ("axes-exchanged", "the axes x and y of a tube's sensors are exchanged", deceptions.axes_exchanged),
            ("tubes-exchanged", "two tubes have each other's calibration", deceptions.calibrations_exchanged),
            ("hole-moves", "the hole leans over by 0.2 to 2 deg", deceptions.hole_moves),
            ("depth-scale", "the depth counts 5 to 20 % too much or too little", deceptions.depth_scale),
            ("depth-stuck", "the depth follows the bit no more", deceptions.depth_stuck),
        )
    ),
    FaultKind("joint-misread", "a mark of the top tube is told wrong by 3 to 30 deg", deceptions.joint_misread),
    *(
        FaultKind(name, meaning, deceptions.tell_wrongly(name, parameters_of))
        for name, meaning, parameters_of in (
            ("north-wrong", "north is told wrong by 5 to 120 deg", deceptions.north_wrong),
            ("collar-wrong", "the collar is told to lean by up to 10 deg", deceptions.collar_wrong),
            ("length-wrong", "a tube is told to be 0.1 to 0.5 m longer than it is", deceptions.length_wrong),
        )
    ),
)
KIND_OF = {kind.name: kind for kind in KINDS}
LASTING = frozenset({"encoder-slips", *EXPECTED})  # that no repair of a crew takes back
ANSWERS: dict[str, str] = {
    "node-cut": "it continues from its saved state and repeats its messages until they are receipted",
    "encoder-cut": "a new epoch of rig time; the nodes compare clocks again",
    "encoder-from-zero": "a new epoch; a survey keeps its epoch and is placed by the depths of that epoch",
    "ground-cut": "the tubes keep and repeat their messages; missed stands come with the next reading of the depth",
    "ground-off-across-stop": "the survey is placed by the stand that the depth source repeats",
    "all-cut": "every process continues from its disk, in any order",
    "cut-while-saving": "the disk holds the old state or the new one; nothing is receipted before it is on the disk",
    "cut-again-and-again": "each start has its own number and continues from the saved state",
    "frozen": "its neighbours find it silent, and then back; missed cycles are counted",
    "slow": "frames are repeated; late clock comparisons are not used",
    "node-memory-lost": "its numbers begin a new series; the yaw comes from the encoder, the bias after 50 s of rest",
    "old-receipts": "a receipt names the content, so old ones have no effect",
    "node-memory-rots": "damaged slots are reported and skipped",
    "bytes-rot": "damage is found by checksum and skipped",
    "boots-damaged": "the start gets a random number that counting never reaches",
    "encoder-boots-lost": "a new epoch; earlier depths are not mixed with later ones",
    "surveys-lost": "earlier surveys cannot be sent again; new ones are kept",
    "node-disk-refuses": "it goes on and relays, sets a flag and tries again every 30 s",
    "ground-disk-refuses": "the ground station answers from it and receipts nothing; the tubes repeat until it accepts",
    "folders-swapped": "the memory of another tube is refused by its number; each starts as new",
    "same-number": "numbers of two series are kept apart by their content",
    "database-deleted": "the string is learnt anew; the tubes are asked for what is missing",
    "database-old": "the tubes are asked for the numbers that the backup lacks",
    "clock-jumps": "the exchange of time finds it; the yaw is taken anew where it matters",
    "clock-drifts": "the clock filter follows",
    "loss": "frames are repeated",
    "bursts": "frames are repeated",
    "duplicates": "numbers are taken once",
    "reordering": "numbers are put in order; old best-effort messages are replaced",
    "corruption": "a checksum drops the frame, which comes again",
    "asymmetric": "what is not acknowledged is repeated; a neighbour that is not heard is silent",
    "joint-severed": "all below is silent; surveys wait in the outbox",
    "joint-deaf": "no aiding: the variance of the yaw grows; receipts come later",
    "gyro-stuck": "the encoder's rate replaces its own; the survey is set aside or its yaw is unknown",
    "gyro-saturated": "the same",
    "gyro-saturated-below": "the same",
    "gyro-step": "the yaw is unknown until the bias is learnt from the encoder",
    "gyro-scale": "the scale is learnt; meanwhile the yaw is unknown",
    "force-stuck": "surveys made of it are not fused",
    "force-saturated": "surveys made of it are not fused",
    "not-finite": "such readings are left out",
    "encoder-dead": "all gyroscopes contradict it at once",
    "encoder-slips": "the yaws follow the encoder, and the crew is told that they all did",
    "depth-lost": "surveys are kept and not placed",
    "depth-jumps-up": "refused until it returns or the crew accepts it, as are stands of that time",
    "depth-jumps-down": "the same",
    "depth-backwards": "the same",
    "depth-ahead": "refused",
    "garbage": "counted and dropped",
    "forged-neighbour": "an impossible hop count and foreign receipts are counted",
    "wild-numbers": "refused, or outvoted by the next exchange",
    "replay": "each number is taken once; an old state is not a sign of life",
    "splice": "the same",
    "second-ground": "the link begins a new session each time; what was on its way is repeated",
} | {name: expected.answer for name, expected in EXPECTED.items()}
