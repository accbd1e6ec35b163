"""Commands that compute surveys and walls."""
