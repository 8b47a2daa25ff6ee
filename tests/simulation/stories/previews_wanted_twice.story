tractiond simulation, version 1
# A client subscribed twice, cancelled that once, and previews were made for nobody.
seed 1
lasts 20000 ms
3000 ms: previews 400 for 5000 ms
9000 ms: previews 300 for 8000 ms
