"""Heights: levelled by the undeformed surface, and compared with balls and domes."""
