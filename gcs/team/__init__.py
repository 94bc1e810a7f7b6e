"""A team in motion: the coordinator, its members, what each does next, and the I/O around them."""
