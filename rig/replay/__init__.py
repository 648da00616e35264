"""A recorded run repeated offline by the code that runs live: the same, or with other settings."""
