"""Networks, self-supervised collection, and the three trainings."""
