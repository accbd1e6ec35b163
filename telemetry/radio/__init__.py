"""Physics of the radio between tubes, through soil and inside the pipe: pure functions of numbers and arrays."""
