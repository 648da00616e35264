"""The targets the framework (1)-(2) is applied to, one small model each."""
