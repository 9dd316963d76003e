"""How surfaces reflect and transmit light."""
