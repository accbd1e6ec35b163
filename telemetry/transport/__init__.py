"""How payloads cross one joint."""
