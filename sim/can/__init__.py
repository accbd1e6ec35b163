"""CAN segments without hardware: wires that pace, arbitrate, acknowledge and fail as real ones do."""
