"""What a rig can be asked to do: each a Plan, a prediction and a run."""
