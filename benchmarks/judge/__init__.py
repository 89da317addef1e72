"""A second, slow judge of plans, written from ``docs/trust.md`` and ``docs/plan_file.md`` alone.

It looks at samples only, with Pinocchio, numpy, scipy and coal. It knows nothing of the
certificate's code, so a mistake in one of the two shows as a disagreement.
"""
