"""Twelve plans, from the smallest to the largest."""

import houseexpo

plans = houseexpo.open_dataset("plans/demo").select(min_quality=0.8).sort("area")
twelve = plans[[round(i * (len(plans) - 1) / 11) for i in range(12)]]
twelve.plot(12, columns=4, size=2.2).savefig("contact_sheet.png", dpi=90)
