"""OptiTrack's NatNet protocol, versions 3.0 to 4.5: parser, encoder, client, and a server as its simulation twin.

Sources: the vendor's documentation of the NatNet SDK (data types, remote commands, unicast subscription) and its
direct depacketization samples for the order and size of fields; packets of Motive for what both leave open.
"""
