"""What a rigid-body model lacks, by name: one file for each effect."""
