"""Training of networks for ``core.force_cnn``, on virtual units or on a recording.

May import whatever evaluation may; PyTorch only inside functions.
"""
