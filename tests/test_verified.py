"""A short run of ``make verify``: every closed form against its independent reference."""

import pytest
from verification import examine, forms


@pytest.mark.parametrize("form", forms(), ids=lambda form: form.name)
def test_closed_form_agrees_with_its_reference_within_its_bound(form):
    examine(form, 150).assert_good(form)
