"""What a vehicle decides: modes, arming, missions, failsafes."""
