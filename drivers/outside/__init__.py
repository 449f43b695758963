"""Programs outside the station, in any language: their wrenches and requests as JSON texts over Zenoh."""
