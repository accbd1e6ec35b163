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
    record = settings[0]
    record["state_every"], record["imus"], record["joints"], record["torsion_gate"] = 2, imus, joints, 1
    record["stiffness"], record["aiding_old_after"], record["unseen_var"], record["stamp_walk"] = 3e4, 3.0, 1e-8, 3e-6
    record["rate_range"], record["force_range"], record["repeats_together"], record["repeats_alone"] = 8.7, 78.0, 4, 8
    for name in ("gyro_noise", "bias_std", "force_std"):
        record[f"plain_{name}"] = configs[0][name]
    record["noise"][:] = 1.0
    record["noise"][:3] = 1.0, 1.5, 0.7
    record["weight"] = record["noise"] ** -2.0
    record["drive_angle"], record["drive_var"], record["lower_angle"], record["lower_var"] = 0.3, 1e-6, 1.0, 1e-6
    parameters["identity"][0] = 0
    for sensor, bias in (("gyroscope", 1e-3), ("accelerometer", 5e-3)):
        parameters[0][sensor]["matrix"][:2] += random.normal(0.0, [[[1e-2]], [[1e-4]]], (2, 3, 3))
        parameters[0][sensor]["bias"][:2] = random.normal(0.0, [[bias], [1e-2 * bias]], (2, 3))
    if imus > 1:
        begin_cluster(nodes[0], record)
    return nodes, settings, parameters


def events_since(nodes: np.ndarray, said: int) -> list[tuple[Any, ...]]:
    """Codes and numbers of the events that were not taken yet."""
    events = nodes[0]["events"]
    ring = [events["ring"][k % EVENTS_KEPT] for k in range(said, int(events["told"]))]
    events["said"] = events["told"]
    return [(Code(int(event["code"])).name, *event["numbers"].tolist()) for event in ring]
