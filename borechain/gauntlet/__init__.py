"""The whole rig under faults that one integer draws, and what must hold in spite of them."""
