"""Truth and sensors of one scenario and seed."""
