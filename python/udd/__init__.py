"""The laboratory of the upward-driven disk.

Film the device, get its motion, fit the model, find what the model lacks, and explore what the
model does.
"""

from __future__ import annotations
