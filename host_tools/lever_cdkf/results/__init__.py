"""What a run or a replay leaves behind, and its statistics."""
