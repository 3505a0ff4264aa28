"""With the extra ``fast`` the kernels are timed; with TACTILE_FAST=0 numpy is."""

from tactile_core.algorithms import kernels

kernels.load()
