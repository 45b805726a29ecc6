"""A client of OptiTrack's NatNet protocol, versions 3.0 to 4.5; its simulation twin has the server's half.

Sources: the vendor's documentation of the NatNet SDK (data types, remote commands, unicast subscription) and its
direct depacketization samples for the order and size of fields; packets of Motive for what both leave open.
"""
