"""What operators order, uploads and the calibration in the field."""
