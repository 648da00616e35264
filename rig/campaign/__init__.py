"""Many simulated runs compared: estimators, camera motions and conditions, over seeds.

``cases`` says which runs there are, ``worker`` does one of them, ``store`` keeps what is done,
``campaign`` hands the rest out to processes, ``table`` and ``figure`` show the result.
"""
