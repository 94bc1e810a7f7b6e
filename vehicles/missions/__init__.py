"""What a vehicle is told to fly: mission, fence and rally lists, and the files they come from."""
