import pandas  # pip install pandas
ticks = pandas.read_csv("fall/node_actuator.csv")
print(ticks.push_age_ms.describe(), ticks[ticks.push_age_ms > 150].time_s)
