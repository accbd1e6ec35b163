"""What is wrong: looked for, told to the crew, and summed up in a verdict. No I/O."""
