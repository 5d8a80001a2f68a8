"""Style operators: pure functions from hair to hair, worked through in the order of the config.

An operator takes `(hair, its options, ground, chance)`. A strand depends on the seed, its index and the middles of
its clumps alone, never on the strands made beside it: any chunk of hair gives the same bytes.
"""
