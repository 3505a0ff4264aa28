"""How numerical libraries are kept to one thread."""

from __future__ import annotations

# Environment in which they use one thread; each library reads it when it is imported. Images and
# matrices are small: further threads only wait for each other, and while they wait they keep a
# processor busy (ADR 84).
ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"), "1"
)
