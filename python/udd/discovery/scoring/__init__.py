"""Score tests of candidate effects."""
