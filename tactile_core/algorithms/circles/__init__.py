"""Contact circles of balls of known radius, located to sub-pixel accuracy without user input.

A press is compared with the reference by the logarithm of their ratio, which does not depend on how
much light there is (``press``). The slope of a ball is an odd function of the offset from its
centre, and to first order so is the change. The most negative peak of its self-convolution starts
the search (``symmetry``, ``start``). Where an image darkens with depth instead, its gradient is
odd. On the ball the normal is (p − c) / R exactly, so for known centres the change is linear in the
unknown light; around the contact the slope falls exponentially. Centre, contact and the light at
its place are fitted to each press together (``press_fit``), and the common light to all presses
(``light``), alternately (``finder``). The centres of a grid of balls are given and only refined
(``grid``).
"""
