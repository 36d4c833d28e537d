"""The kinds of shapers, profiles and pulse designs: modules that are made from the records of the methods."""
