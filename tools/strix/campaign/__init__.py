"""`strix campaign`: many flights with one fault each, judged by the truth."""

from strix.campaign.run import Campaign, fly_campaign
from strix.campaign.table import print_campaign

__all__ = ["Campaign", "fly_campaign", "print_campaign"]
