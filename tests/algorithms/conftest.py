from support.kernel_paths import _no_kernel_without_its_numpy  # noqa: F401
