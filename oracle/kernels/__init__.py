"""Formulas, one emitter or shape a module, for receivers (N, 3); `oracle.irradiances` chooses among them."""
