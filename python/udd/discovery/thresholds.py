"""Thresholds of the search, and the words for what came of its tests."""

from __future__ import annotations

from typing import Literal

#: Family-wise error rate: the chance that a record without any effect is said to have one, over all of the
#: candidates together (Bonferroni: each is tested at this over their number).
ALPHA = 1e-3
#: Forms more alike than this move the same data in the same way, like a slip c Z and a relaxation -b W Z at
#: one drive.
SAME = 0.9999
#: What bears an effect out, of data that were not fitted.
Confirmation = Literal["held", "fitted", "halves"]
#: Why an effect is not added: chance does as much, in all data or in the part that effects are sought in; a
#: slow drift of the sensor's zero explains more; the held-out data do not bear it out; another form that fits
#: better fails; or it passed all tests but free runs over the held-out data do not get better beyond doubt.
#: Or only some of several records want it, though the others could show it.
RejectionReason = Literal["chance", "drift", "part", "held", "form", "unconfirmed", "records"]
