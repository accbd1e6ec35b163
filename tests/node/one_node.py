"""A node by itself for the tests that run it in integers and in floats: its records, and what it tells."""

from typing import Any

import numpy as np

from node.kernels.record.events import Code
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import EVENTS_KEPT, SETTINGS, new_node
from node.kernels.sensors.cluster import begin_cluster
from node.kernels.sensors.correction import identity_parameters


def node_of(imus: int, joints: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Records of a node of several IMUs with a block of parameters."""
    configs, settings = default_config(), np.zeros(1, SETTINGS)
    nodes, parameters = new_node(configs), np.concatenate([identity_parameters()] * (1 + imus))
    crew = settings[0]
    crew["state_every"], crew["imus"], crew["joints"], crew["torsion_gate"] = 2, imus, joints, 1
    crew["stiffness"], crew["aiding_old_after"], crew["unseen_var"], crew["stamp_walk"] = 3e4, 3.0, 1e-8, 3e-6
    crew["rate_range"], crew["force_range"], crew["repeats_together"], crew["repeats_alone"] = 8.7, 78.0, 4, 8
    for name in ("gyro_noise", "bias_std", "force_std"):
        crew[f"plain_{name}"] = configs[0][name]
    crew["noise"][:] = 1.0
    crew["noise"][:3] = 1.0, 1.5, 0.7
    crew["weight"] = crew["noise"] ** -2.0
    crew["drive_angle"], crew["drive_var"], crew["lower_angle"], crew["lower_var"] = 0.3, 1e-6, 1.0, 1e-6
    parameters["identity"][0] = 0
    for sensor, bias in (("gyroscope", 1e-3), ("accelerometer", 5e-3)):
        parameters[0][sensor]["matrix"][:2] += random.normal(0.0, [[[1e-2]], [[1e-4]]], (2, 3, 3))
        parameters[0][sensor]["bias"][:2] = random.normal(0.0, [[bias], [1e-2 * bias]], (2, 3))
    if imus > 1:
        begin_cluster(nodes[0], crew)
    return nodes, settings, parameters


def events_since(nodes: np.ndarray, said: int) -> list[tuple[Any, ...]]:
    """Codes and numbers of the events that nobody has taken yet."""
    events = nodes[0]["events"]
    ring = [events["ring"][k % EVENTS_KEPT] for k in range(said, int(events["told"]))]
    events["said"] = events["told"]
    return [(Code(int(event["code"])).name, *event["numbers"].tolist()) for event in ring]
