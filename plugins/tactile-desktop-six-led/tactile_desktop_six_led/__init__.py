"""The desktop rig (Johnson, Cole, Raj, Adelson 2011) for tactile-core."""
