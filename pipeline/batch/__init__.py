"""The stages of one config or of many: what is fresh, what is made, and what experiments share."""
