<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<!-- Aspect in degrees, a colour wheel of even lightness: blue faces north, yellow south. -->
<qgis version="3.22.0" styleCategories="Symbology">
  <pipe>
    <provider>
      <resampling enabled="true" zoomedInResamplingMethod="nearestNeighbour" zoomedOutResamplingMethod="nearestNeighbour" maxOversampling="2"/>
    </provider>
    <rasterrenderer type="singlebandpseudocolor" band="1" opacity="1" alphaBand="-1" nodataColor="" classificationMin="0" classificationMax="360">
      <rasterTransparency/>
      <minMaxOrigin>
        <limits>None</limits>
        <extent>WholeRaster</extent>
        <statAccuracy>Estimated</statAccuracy>
      </minMaxOrigin>
      <rastershader>
        <colorrampshader colorRampType="INTERPOLATED" classificationMode="1" clip="0" minimumValue="0" maximumValue="360" labelPrecision="0">
          <colorramp type="gradient" name="[source]">
            <Option type="Map">
              <Option type="QString" name="color1" value="91,132,196,255"/>
              <Option type="QString" name="color2" value="91,132,196,255"/>
              <Option type="QString" name="discrete" value="0"/>
              <Option type="QString" name="rampType" value="gradient"/>
              <Option type="QString" name="stops" value="0.125;69,160,174,255:0.25;95,174,122,255:0.375;163,176,79,255:0.5;220,171,75,255:0.625;229,138,107,255:0.75;207,115,156,255:0.875;148,120,192,255"/>
            </Option>
          </colorramp>
          <item value="0" label="0 (north)" color="#5b84c4" alpha="255"/>
          <item value="45" label="45" color="#45a0ae" alpha="255"/>
          <item value="90" label="90 (east)" color="#5fae7a" alpha="255"/>
          <item value="135" label="135" color="#a3b04f" alpha="255"/>
          <item value="180" label="180 (south)" color="#dcab4b" alpha="255"/>
          <item value="225" label="225" color="#e58a6b" alpha="255"/>
          <item value="270" label="270 (west)" color="#cf739c" alpha="255"/>
          <item value="315" label="315" color="#9478c0" alpha="255"/>
          <item value="360" label="360 (north)" color="#5b84c4" alpha="255"/>
        </colorrampshader>
      </rastershader>
    </rasterrenderer>
    <brightnesscontrast brightness="0" contrast="0" gamma="1"/>
    <huesaturation saturation="0" grayscaleMode="0" colorizeOn="0"/>
    <rasterresampler maxOversampling="2"/>
    <resamplingStage>provider</resamplingStage>
  </pipe>
  <blendMode>0</blendMode>
</qgis>
