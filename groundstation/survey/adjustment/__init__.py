"""One adjustment of the whole hole: directions, tubes, joints and path from every look at every station. No I/O."""
