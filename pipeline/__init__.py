"""ringlet: config -> groom -> simulate -> interpolate -> render."""
