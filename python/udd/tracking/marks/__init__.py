"""Marks on a rigid body: where they are, and the pose they show."""
