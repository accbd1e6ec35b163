"""What every number that enters has to pass: values that stand for none, ranges, plausibility, and warnings of it."""
