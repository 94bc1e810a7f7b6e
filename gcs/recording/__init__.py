"""The Rerun recording, written by a process of its own."""
