"""The buses; the only room that knows their libraries."""
