"""The four-colour fingertip of the Baxter gripper (Li et al. 2014) for tactile-core."""
