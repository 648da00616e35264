"""The active part: how the camera should move so that the estimate converges well."""
