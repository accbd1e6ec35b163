"""Streams of random numbers: each consumer has one of its own, so that nothing else changes its draws.

``RandomStream`` is the one table of purposes. A stream is named by the seed, its purpose and what parts it further (a
tube, an IMU, a port), so that no draw depends on the order of others. A number once given is never used for another
purpose.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np


class RandomStream(IntEnum):
    """Purpose of a stream."""

    JOINTS = 0  # 0: true angles, 1: errors of their readings
    MOUNTS = 1  # 0: about the axis; tube and IMU: tilt
    CLOCKS = 2
    GYRO = 3
    ACCELEROMETER = 4
    DRIVE = 5  # angle of the head at the start
    DRIFT = 6  # of sensors since their calibration
    RACK = 7
    DISC = 8  # places of the encoder's lines
    TORSION = 16  # what friction traps
    SLIPS = 17  # what turns unseen at a make-up, and how far the head turns meanwhile
    PHASES = 18  # of the cycles of tubes against that of the encoder
    AIDING_PHASE = 19  # of the times in which aiding passes
    AIDING_LOSS = 20
    AIDING_CLOCKS = 21  # errors of rig time where no link synchronises it
    RADIO = 22  # fate and delays of the frames from one port to another
    RADIO_FADE = 23  # constant loss of a joint
    RADIO_BURSTS = 24
    # 0: which kinds of faults, 1: when and what, 2: ports, 3: strangers, 4: disks, 5: disks before, 6: seams, 7: tags
    GAUNTLET = 25
    LOTS = 26  # of starts that are numbered by lot
    DRAWN_HOLES = 27  # shape of a hole that is drawn
    PLAY = 28  # how a tube lies in the hole: 0: at every stop, 1: its own bow
    EXCHANGED = 29  # what a calibration takes away, of tubes that have each other's
    DEPTH_ERRORS = 30  # of the measured depth, at every stop
    SET_UP = 31  # what a crew tells, of rigs that are drawn
    ROUGH_STOPS = 40  # how far a string runs on into its play
    ROUGH_ENCODER = 41  # where a disc is off its centre
    ROUGH_OUTLIERS = 42  # of the encoder, by the time of the reading
    ROUGH_VIBRATION = 43  # tube, IMU; 0: about the axis, 1: of the forces
    ROUGH_FRAMES = 44  # phase of a FIFO
    ROUGH_JITTER = 45  # of an IMU's time stamps
    ROUGH_PULL = 46  # of the force on a gyroscope's axes
    ROUGH_STOP_ANGLES = 47  # where a driller stops
    INCREMENTS = 48  # noise of the eighths of a cycle about their mean
    WELLS = 2000  # a string in one of many wells, for the coverage of ellipses
    PATHS = 2001  # a hole of a kind, for the projection
    TURN_TABLE = 3001  # a gyroscope and its table
    ROBOT_ARM = 3002  # an accelerometer and its arm
    FIELD = 3003  # constants of a disturbance that a study draws, and a bad day
    LINK = 0xA1  # fate and delays of the frames of one port


class JigStream(IntEnum):
    """Purpose of a stream of an MWD tool, whose seeds are apart from those of strings."""

    TOOL = 0  # its true coefficients
    DESIGN = 1  # order of the tool faces
    FRESH = 2  # attitudes that no calibration has seen
    READINGS = 3  # noise, and the stand of the jig


def random_stream(*key: int) -> np.random.Generator:
    """The stream of a seed and whatever parts it from others; the same in every process and on every machine."""
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(key)))
