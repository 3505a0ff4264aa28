"""Properties of the gel where a profile gives none.

References
----------
.. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
   GelSight tactile sensor", ICRA, 2015.
"""

THICKNESS_MM = 2.0  # [mm] The test sheet of [1]_: 23.4 × 22.6 × 2.0 mm
SHEAR_MODULUS_MPA = 0.145  # [MPa] Neo-Hookean coefficient of the silicone XP-565 [1]_
POISSON_RATIO = 0.48  # [ratio] Nearly incompressible, chosen by hand: the papers give none
