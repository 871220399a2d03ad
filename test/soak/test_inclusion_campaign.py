"""The package against the second method of the tests: 10⁵ scripts of all features at once.

make soak                                     # with the rest; about half an hour of one core
BOUNCING_DISK_SCRIPTS=2000 .venv/bin/pytest -m soak -s test/soak/test_inclusion_campaign.py
BOUNCING_DISK_SCRIPT_SEED=123 ...             # the first seed; drawn and printed if not given
"""

from __future__ import annotations

import os
import secrets

import pytest

from support.scripted import judge_scripts

SCRIPTS = int(os.environ.get("BOUNCING_DISK_SCRIPTS", "100000"))
PART = 1000

pytestmark = [pytest.mark.soak, pytest.mark.timeout(6 * 3600)]


def test_random_scripts_agree_with_the_second_method() -> None:
    first = int(os.environ.get("BOUNCING_DISK_SCRIPT_SEED", secrets.randbits(40)))
    print(f"\nscripts from seed {first}")
    samples = impacts = 0
    for begin in range(first, first + SCRIPTS, PART):
        found = judge_scripts(range(begin, min(begin + PART, first + SCRIPTS)))
        assert found.differences == []
        samples, impacts = samples + found.samples, impacts + found.impacts
    print(f"{SCRIPTS} scripts: {samples} samples and {impacts} impacts agree")
