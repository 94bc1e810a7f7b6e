"""What keeps vehicles that are not ours safe: before they arm, while they fly, and at the end."""
