"""Any surface prim: as authored, how large it looks, how often it is refined, and as triangles."""
