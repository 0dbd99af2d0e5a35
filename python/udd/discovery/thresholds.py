"""Thresholds of the search, and names for the results of its tests."""

from __future__ import annotations

from typing import Literal

#: Family-wise error rate: the probability of reporting an effect in a record without any, over all candidates
#: together (Bonferroni: each is tested at this over their number).
ALPHA = 1e-3
#: Difference in log evidence (nats) below which explanations are not distinguished.
EVIDENCE_MARGIN = 10.0
#: The same for scores, and for fits of a part of the data.
ROUGH_MARGIN = 3 * EVIDENCE_MARGIN
#: Likeness above which forms act identically on the data, such as a slip c Z and a relaxation -b W Z at
#: one drive.
SAME = 1.0 - 1e-6
#: Test by which data that were not fitted confirm an effect.
Confirmation = Literal["held", "fitted", "halves"]
#: Reason for rejection, see :class:`udd.discovery.RejectedEffect`.
RejectionReason = Literal["chance", "drift", "part", "held", "form", "unconfirmed", "records"]
