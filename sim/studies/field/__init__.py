"""What a node makes of a field's world, disturbance by disturbance."""
